"""Rates of publication that a user chooses."""

from solfer.errors import ConfigError, SimulationError, UnknownName
from solfer.simulation.physics import STEP
from solfer.simulation.sensors import Rates


def every(rate: float, where: str = "") -> int:
    """Compute the steps between two publications at `rate` [Hz].

    Raises:
        SimulationError: That is not a whole number of steps; `where` is the place of the rate.
    """
    steps = round(1.0 / (rate * STEP)) if rate > 1e-6 else 0  # a lower rate makes no sense
    if steps < 1 or abs(steps * rate * STEP - 1.0) > 1e-9:
        raise SimulationError(
            f"{rate:g} Hz is not a rate of publication",
            where=where,
            expected=f"{1.0 / STEP:g} Hz divided by a whole number",
        )
    return steps


def changed_rates(rates: Rates, text: str) -> Rates:
    """Replace some of the rates.

    Args:
        rates: All rates.
        text: The new ones: `joints=500,contacts=200`; empty: none.

    Raises:
        ConfigError: The text is written otherwise.
        UnknownName: There is no such rate.
        SimulationError: A rate is not the rate of the steps divided by a whole number.
    """
    given: dict[str, float] = {}
    for part in filter(None, text.split(",")):
        name, _, number = (word.strip() for word in part.partition("="))
        where = f"rates '{text}'"
        if name not in Rates.model_fields:
            raise UnknownName("rate", name, tuple(Rates.model_fields), where=where)
        if name in given:
            raise ConfigError(f"rate '{name}' is given twice", where=where, expected="each rate once")
        try:
            given[name] = float(number)
        except ValueError as error:
            raise ConfigError(
                f"'{part.strip()}' is not a rate",
                where=where,
                expected="NAME=HZ, several with commas between, such as joints=500,contacts=200",
            ) from error
        every(given[name], where)
    return rates.model_copy(update=given)
