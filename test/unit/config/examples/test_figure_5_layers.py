"""Fig. 5 in ROS and as a real-time layer, simulated and on hardware: the parameter differs, and what hangs on it."""

import re

import pytest
import yaml

from solfer.config import load, load_shared
from solfer.config.loading.rt_layer import read_layer
from solfer.plugins import Registry

BETWEEN_LAYERS = {
    r"middleware",
    r"modules\.\w+\.layer",
    r"robot\.rate",
    r"modules\.odometry\.(filter|velocity)\.(cut_off_frequency|damping)",  # by the rate
    r"SECTION\.feedback\.(manipulation|lower_body|base|vertices)\.layer",  # the bridge would carry it
}
BETWEEN_SYSTEMS = {
    r"system",
    r"calibration\.encoders\.joints\..*",
    r"(feedback|controller)\.\w+\.calibration",
    r"feedback\.link_side_online\.limits\.tolerance\.position",
    r"feedback\.imu_base\.offset_(position|orientation)\.\w+",
}


@pytest.fixture(scope="module")
def effective(repository):
    """Return the effective values of all plugins, by the middleware and the system."""
    main, registry = repository / "config" / "centauro.yaml", Registry()
    layer = read_layer(repository / "config" / "figures" / "figure_5.yaml", registry.configuration)

    def plugins(middleware, system):
        if middleware == "XBOT":
            return [each.configuration for each in layer.load(system)]
        shared = load_shared(main, "full_control", default=registry.configuration, system=system)
        return [load(main, "hands", system=system), *(each.configuration for each in shared.plugins)]

    return {
        (middleware, system): {
            (each.module.name, re.sub(r"^(ros|xbot)\.", "SECTION.", key)): value
            for each in plugins(middleware, system)
            for key, value in flat(yaml.safe_load(each.text(origins=False))["mwoibn"])
        }
        for middleware in ("ROS", "XBOT")
        for system in ("SM", "HW")
    }


def flat(tree, prefix=""):
    """Yield all values with their ways, joined by dots."""
    for key, value in tree.items():
        way = f"{prefix}{key}"
        if isinstance(value, dict) and value:
            yield from flat(value, f"{way}.")
        else:
            yield way, value


@pytest.mark.slow
@pytest.mark.parametrize(
    ("one", "other", "allowed"),
    [
        (("ROS", "SM"), ("XBOT", "SM"), BETWEEN_LAYERS),
        (("ROS", "HW"), ("XBOT", "HW"), BETWEEN_LAYERS),
        (("ROS", "SM"), ("ROS", "HW"), BETWEEN_SYSTEMS),
        (("XBOT", "SM"), ("XBOT", "HW"), BETWEEN_SYSTEMS),
    ],
)
def test_what_differs_hangs_on_the_parameter(effective, one, other, allowed):
    first, second = effective[one], effective[other]
    assert {name for name, _ in first} == {name for name, _ in second} and len({name for name, _ in first}) == 5
    different = {key for _, key in {way for way, _ in first.items() ^ second.items()}}
    used = {pattern for pattern in allowed for key in different if re.fullmatch(pattern, key)}
    assert not [key for key in different if not any(re.fullmatch(pattern, key) for pattern in allowed)]
    assert used == allowed
