"""Records of the file of a study."""

from typing import Annotated, Any, Literal

from pydantic import Field, model_validator

from solfer.config import FileRecord, Record
from solfer.config.records.bounds import SEED, Bounds, Name, Offset
from solfer.simulation.world.records import EngineName

TIME: Bounds = {"ge": 0.0, "le": 1e5}
"""Times of a motion [s]."""

Force = Annotated[tuple[Annotated[float, Field(ge=-1e5, le=1e5)], ...], Field(min_length=3, max_length=3)]
"""Components of a force [N]."""

Pair = Annotated[tuple[Annotated[float, Field(ge=-1e9, le=1e9)], ...], Field(min_length=2, max_length=2)]
"""Bounds of what is drawn; the tag that varies has its own."""

DRAWN_KEYS = ("uniform", "log_uniform", "normal", "choice")
"""Keys of a variation that is drawn for each run."""


class PayloadRecord(Record):
    """A mass that is fixed to a link, and that no controller knows."""

    link: Name = Field(description="the link")
    mass: float = Field(ge=0.0, le=1e4, description="its mass [kg]")
    center: Offset = Field(default=(0.0, 0.0, 0.0), description="where it is in the frame of the link [m]")


class PushRecord(Record):
    """A force on a link."""

    link: Name = Field(description="the link")
    at: float = Field(ge=0.0, le=1e5, description="when it begins, after the begin of the motion [s]")
    force: Force = Field(description="force at the link's origin, in world axes [N]")
    duration: float = Field(default=0.2, gt=0.0, le=10.0, description="how long it acts [s]")


class SimulationRecord(Record):
    """The simulated robot, and how it differs from the one that its controllers know."""

    robot: Name = Field(default="centauro", description="robot of this package, or the file of one")
    world: Name = Field(default="flat", description="world of this package, or the file of one")
    engine: EngineName | None = Field(default=None, description="physics engine; default: the one of the world")
    state: Name | None = Field(default=None, description="named state in which it begins")
    transport: FileRecord | None = Field(default=None, description="faults of the transport; default: it has none")
    perfect: bool = Field(default=False, description="whether sensors measure without errors and without delay")
    noise: float = Field(default=1.0, ge=0.0, le=1e3, description="factor of the errors of IMU and joints")
    delay: float | None = Field(
        default=None, ge=0.0, le=0.1, description="time from a measurement to its message [s]; default: the robot's"
    )
    friction: dict[str, Annotated[float, Field(ge=0.0, le=10.0)]] = Field(
        default_factory=dict, description="coefficients by link, group of links, or part of the world"
    )
    mass: float = Field(default=1.0, gt=0.0, le=100.0, description="factor of all masses and inertias")
    center: Offset = Field(default=(0.0, 0.0, 0.0), description="displacement of each centre of mass in its link [m]")
    payload: PayloadRecord | None = Field(default=None, description="a mass that is fixed to a link")
    pushes: tuple[PushRecord, ...] = Field(default=(), description="forces from outside")


class MovingRecord(Record):
    """What moves the robot: a scenario, references, or a function of one's own."""

    scenario: FileRecord | None = Field(default=None, description="scenario that is played")
    references: FileRecord | None = Field(default=None, description="references that are published")
    function: str | None = Field(
        default=None,
        pattern=r"^[\w.]+:\w+$",
        description="`package.module:function`, called with the `SimulatedRun` and the record of the study",
    )
    positions: bool = Field(default=False, description="scenarios: whether positions are published, as in Fig. 5")
    target: str = Field(default="wheeled_motion", description="name of the component that is moved")
    odometry: str = Field(
        default="odometry/odom", description="topic of the heading at the beginning; empty: it is zero"
    )

    @model_validator(mode="after")
    def _at_most_one(self) -> "MovingRecord":
        if sum(each is not None for each in (self.scenario, self.references, self.function)) > 1:
            raise ValueError("one of `scenario`, `references` and `function`")
        return self


class VariationRecord(Record):
    """A value that varies: each value of `grid` with all others, those of `list` side by side, or one that is drawn."""

    unit: str = Field(default="", description="its unit, for the report")
    path: Name | None = Field(
        default=None,
        description="keys that lead to it: `simulation/mass`, `motion/scenario`, or `configuration/modules/NAME/TAG`; "
        "default: the name of the variation",
    )
    grid: tuple[Any, ...] | None = Field(default=None, min_length=1, description="values; with each of other grids")
    list: tuple[Any, ...] | None = Field(default=None, min_length=1, description="values; those of lists go together")
    choice: tuple[Any, ...] | None = Field(default=None, min_length=1, description="values, one of which is drawn")
    uniform: Pair | None = Field(default=None, description="least and largest value")
    log_uniform: Pair | None = Field(default=None, description="the same, of the logarithm")
    normal: Pair | None = Field(default=None, description="mean and standard deviation")

    @property
    def kind(self) -> str:
        """Which of its keys is given."""
        return self._given()[0]

    def _given(self) -> tuple[str, ...]:
        return tuple(key for key in ("grid", "list", *DRAWN_KEYS) if getattr(self, key) is not None)

    @model_validator(mode="after")
    def _exactly_one(self) -> "VariationRecord":
        given = self._given()
        if len(given) != 1:
            raise ValueError("one of `grid`, `list`, `choice`, `uniform`, `log_uniform` and `normal`")
        if given[0] in ("uniform", "log_uniform"):
            low, high = getattr(self, given[0])
            if not low < high or (given[0] == "log_uniform" and low <= 0.0):
                raise ValueError(f"`{given[0]}` with the least value first" + ", above 0" * (given[0] != "uniform"))
        if self.normal is not None and self.normal[1] < 0.0:
            raise ValueError("`normal` with a standard deviation from 0 on")
        return self


class MeasureRecord(Record):
    """A number of a run: columns that are reduced, or an expression of other measures."""

    unit: str = Field(default="", description="its unit, for the report")
    columns: tuple[str, ...] | str | None = Field(
        default=None,
        min_length=1,
        description="`CHANNEL/COLUMN`; of several the Euclidean norm counts, row by row",
    )
    minus: tuple[str, ...] | str | None = Field(default=None, min_length=1, description="columns that are subtracted")
    reduce: Literal["rms", "max", "min", "mean", "end", "begin", "std", "change"] = Field(
        default="rms", description="what is computed of all rows; `change`: the last less the first"
    )
    absolute: bool = Field(default=False, description="whether the absolute values count")
    since: float = Field(default=0.0, **TIME, description="first time that counts, after the begin of the motion [s]")
    until: float | None = Field(default=None, **TIME, description="last time that counts [s]; default: the end")
    derive: Name | None = Field(default=None, description="expression of measures and variations")

    @model_validator(mode="after")
    def _one_of_both(self) -> "MeasureRecord":
        if (self.columns is None) == (self.derive is None):
            raise ValueError("one of `columns` and `derive`")
        if self.minus is not None and len(_listed(self.minus)) not in (0, len(_listed(self.columns))):
            raise ValueError("`minus` with as many columns as `columns`")
        return self

    def names(self) -> tuple[tuple[str, ...], tuple[str, ...]]:
        """Return the columns, and those that are subtracted."""
        return _listed(self.columns), _listed(self.minus)


def _listed(names: tuple[str, ...] | str | None) -> tuple[str, ...]:
    return () if names is None else (names,) if isinstance(names, str) else names


class RunLimitsRecord(Record):
    """What a run may take; one that takes more has failed."""

    time: float = Field(default=3600.0, gt=0.0, le=1e7, description="time by the clock [s]")
    memory: float = Field(default=4.0, gt=0.0, le=1e5, description="memory [GB]")


class SearchRecord(Record):
    """A search for values with the least or largest measure, by Optuna."""

    minimize: Name | None = Field(default=None, description="measure")
    maximize: Name | None = Field(default=None, description="measure")
    trials: int = Field(default=100, ge=1, le=1_000_000, description="how many values are tried")
    parameters: dict[str, VariationRecord] = Field(min_length=1, description="what is searched: drawn variations")

    @model_validator(mode="after")
    def _one_of_both(self) -> "SearchRecord":
        if (self.minimize is None) == (self.maximize is None):
            raise ValueError("one of `minimize` and `maximize`")
        for name, each in self.parameters.items():
            if each.kind not in ("choice", "uniform", "log_uniform"):
                raise ValueError(f"`{name}` with `choice`, `uniform` or `log_uniform`")
        return self


class StudyRecord(Record):
    """A study."""

    description: str = Field(default="", description="what it is for; stands above its report")
    configuration: FileRecord = Field(description="main configuration of the plugins")
    plugins: tuple[str, ...] = Field(
        min_length=1, description="those that run, each a node: `plugin::configuration`, `plugin`, or a shared plugin"
    )
    simulation: SimulationRecord = Field(default_factory=SimulationRecord, description="the simulated robot")
    motion: MovingRecord = Field(default_factory=MovingRecord, description="what moves it")
    settle: float = Field(default=2.0, ge=0.0, le=60.0, description="time before the motion begins [s]")
    duration: float = Field(
        gt=0.0,
        le=1e5,
        description="time of the motion [s]; one that ends earlier ends the run; one that has not ended has failed",
    )
    seed: int = Field(default=0, **SEED, description="of noise, transport and what is drawn")
    runs: int = Field(default=1, ge=1, le=1_000_000, description="runs of each point of the grid, each with a seed")
    vary: dict[str, VariationRecord] = Field(default_factory=dict, description="what varies, by name")
    measure: dict[str, MeasureRecord] = Field(default_factory=dict, description="what is measured, by name")
    fails: dict[str, str] = Field(default_factory=dict, description="expressions that are true of a run that failed")
    limits: RunLimitsRecord = Field(default_factory=RunLimitsRecord, description="what a run may take")
    search: SearchRecord | None = Field(default=None, description="a search instead of all points of the grid")
