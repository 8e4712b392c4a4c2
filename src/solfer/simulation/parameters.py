"""What a robot's simulator tells about the robot by parameters, where nobody else has done that."""

from solfer.model.cut import cut
from solfer.model.description import Description
from solfer.simulation.records import BundleRecord


def robot_parameters(bundle: BundleRecord) -> dict[str, str]:
    """Model, groups and partial models of a robot, by the names of their parameters.

    Raises:
        ModelError, ConfigError: A file of the bundle is wrong.
    """
    description = Description.from_file(bundle.urdf.location)
    found = {"/robot_description": description.text}
    if bundle.srdf is not None:
        found["/robot_semantic_description"] = bundle.srdf.location.read_text()
    return found | {f"/robot_{name}": cut(description, part.at, part.keep) for name, part in bundle.parts.items()}
