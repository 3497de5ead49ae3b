"""The strip, from which all that is computed starts; all numbers in SI.

Each question has its module in this folder; nothing heavy is imported before something is computed.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass
from math import isclose
from typing import TYPE_CHECKING, Any, Literal, TypeVar, cast

from stripfold.base.arguments import checked, file_name
from stripfold.base.errors import InvalidInputError
from stripfold.base.material import GRAVITY

if TYPE_CHECKING:
    from stripfold.ask.assess import PathAssessment
    from stripfold.ask.collapse import StripCollapse
    from stripfold.ask.critical import CriticalPoint
    from stripfold.ask.inputs import Law, Model, Release
    from stripfold.ask.map import StabilityMap
    from stripfold.ask.plan import FoldingPlan
    from stripfold.base.validation import Gripper, Input, MovingModel
    from stripfold.paths import FoldPath

    M = TypeVar("M", bound=Input)

Progress = Callable[[str], None]


@dataclass(frozen=True)
class Strip:
    """A strip of fabric, held at one end and gripped at the other.

    Where a method has ``progress``, it is called with a line on what is being done.

    Attributes
    ----------
    length
        Length, m.
    eta_b
        Weight-to-bending-stiffness ratio rho_a / D, m^-4 s^2.
    eta_m
        Weight-to-membrane-stiffness ratio, m^-2 s^2.
    nu
        Poisson's ratio.
    rho_a
        Areal density, kg m^-2; scales forces only.
    gravity
        Gravitational acceleration, m s^-2.

    Raises
    ------
    InvalidInputError
        A number outside its limits, or a combination that is no strip, as with a wrong unit.

    Examples
    --------
    >>> import stripfold as sf
    >>> strip = sf.Strip(length=0.6, eta_b=3780)
    >>> round(strip.gravity_length, 5)
    0.02999
    >>> point = strip.critical(height=0.09, model="elastica")
    >>> point.snap, round(point.lambda_c, 5)
    (True, 0.29562)
    """

    length: float
    eta_b: float
    eta_m: float = 1e-3
    nu: float = 0.0
    rho_a: float = 1.0
    gravity: float = GRAVITY

    def __post_init__(self) -> None:
        from stripfold.ask import inputs

        for key, value in inputs.Strip(**asdict(self)):
            object.__setattr__(self, key, value)

    @property
    def gravity_length(self) -> float:
        """L* = (eta_b g)^(-1/3), m: the natural unit of length."""
        return float((self.eta_b * self.gravity) ** (-1.0 / 3.0))

    @checked
    def critical(
        self,
        height: float,
        *,
        model: Model = "solid",
        accuracy: float = 1e-3,
        law: Law = "svk",
        eta_b_uncertainty: float | None = None,
        second_gripper: float | Literal["auto"] | None = None,
        clamp: float | None = None,
        curl: float = 0.0,
        progress: Progress | None = None,
    ) -> CriticalPoint:
        """The critical point: where the strip snaps when its gripper advances at constant height.

        Parameters
        ----------
        height
            Height of the gripper, m.
        model
            "solid", the paper's finite elements; "rod", several times as fast; "elastica", the thin limit; "auto", the
            cheapest of them within the requested accuracy of the solid.
        accuracy
            Requested relative accuracy of lambda_c.
        law
            Constitutive law of the solid, "svk" or "printed" (docs/physics.md, section 2).
        eta_b_uncertainty
            Relative uncertainty of eta_b: the result then has an ``eta_b_range``.
        second_gripper
            Place along the strip, from the first gripper, m, that a second one holds, or "auto": the result then has a
            ``second_gripper``.
        clamp
            Angle at which the gripper clamps the strip, degrees: 0 as it grasps the flat strip, 90 with the strip
            straight down from it; without one it is a hinge.  For the solid and the rod.
        curl
            Curvature of the strip without forces, 1/m, positive where the ends of what lies would curl up; its far end
            is held flat.  For the solid and the rod.

        Raises
        ------
        InvalidInputError
            A number outside its limits, or a strip too short for this height.
        SolveError
            The critical point could not be computed to the accuracy.
        """
        from stripfold.ask.inputs import Scene

        scene = self._asked(Scene, locals())
        from stripfold.ask.critical import find

        return find(scene, progress)

    @checked
    def collapse(
        self,
        height: float,
        *,
        release: Release | Mapping[str, Any] | None = None,
        model: MovingModel | None = None,
        effects: Mapping[str, str] | None = None,
        friction_moment: float = 0.0,
        clamp: float | None = None,
        curl: float = 0.0,
        accuracy: float = 1e-3,
        progress: Progress | None = None,
    ) -> StripCollapse:
        """The strip through its collapse: statics to the critical point, the fall to rest, statics again.

        Parameters
        ----------
        height
            Height of the gripper, m.
        release
            Release of the strip and damping of its fall, or their keys and values.
        model
            "solid" or "rod"; without it the solid, the rod for a strip thinner than 0.01 L*, or with ``effects`` the
            model that those say or need.
        effects
            "auto", "on" or "off" by the effect's name (docs/effects.md); "auto" where none is given.
        friction_moment
            M_0, N: largest moment of the fabric's bending hysteresis, per width.  With it the end is the rest after
            the fall.
        clamp
            Angle at which the gripper clamps the strip, degrees; a hinge where it is not given.
        curl
            Curvature of the strip without forces, 1/m; positive where the ends of what lies would curl up.
        accuracy
            Requested relative accuracy of lambda_c, by which effects are needed or not.

        Raises
        ------
        InvalidInputError
            A value that cannot be used, or a strip too short for this height.
        SolveError, TimeStepError
            A part could not be computed.
        """
        from stripfold.ask.inputs import Release, Simulation
        from stripfold.base.validation import within

        with within("release"):
            released = Release.of({} if release is None else release).model_dump()
        given = asdict(self) | {"height": height, "accuracy": accuracy}
        given |= {"friction_moment": friction_moment, "clamp": clamp, "curl": curl}
        given |= {key: value for key, value in (("model", model), ("effects", effects)) if value is not None}
        asked = Simulation.of(given | released)
        from stripfold.ask.collapse import StripCollapse

        return StripCollapse.of(asked, progress)

    @checked
    def assess(
        self,
        path: FoldPath,
        *,
        fall: bool = False,
        friction_moment: float | None = None,
        pull: float | None = None,
        layer_friction: float | None = None,
        speed: float | Literal["table"] | None = None,
        step: float | None = None,
        second_gripper: float | Literal["auto"] | None = None,
        model: MovingModel | None = None,
        gripper: Gripper = "hinge",
        flatness: float = 5e-4,
        table_friction: float | None = None,
        curl: float = 0.0,
        bending_test: str | os.PathLike[str] | None = None,
        progress: Progress | None = None,
    ) -> PathAssessment:
        """Assess a gripper path: critical points, first touch, final shape, forces.

        The states are static; the first critical point is the end, unless ``fall`` is given.

        Parameters
        ----------
        path
            From :mod:`stripfold.paths`, for this or another strip of this length.
        fall
            Whether to simulate the fall at a critical point and to go on from the state at rest; without friction.
        friction_moment
            M_0, N: largest moment of the fabric's bending hysteresis, per width, half the height of the loop of a
            bending test (docs/physics.md, section 8).  Without friction the strip is followed along its branch.
        pull
            k_f, s^-2, of the paper's internal friction: a force per displacement and mass towards the last accepted
            state; it depends on the size of the steps.
        layer_friction
            Coefficient of friction between the layers and on the floor.  The path is then followed in time, to rest at
            its end; the critical points are those of statics before the first touch.
        speed
            Of the gripper in time, m/s; "table": as the path's own times say, s.  0.2 sqrt(g L*), about 0.1 m/s, where
            it is not given.
        step
            Size of the steps with friction, m; 0.1 L* where it is not given.
        second_gripper
            Place along the strip, from the first gripper, m, that a second one holds from shortly before the first
            critical point on, or "auto": the result then has a ``second_gripper``; without friction.
        model
            "solid" or "rod"; without it the solid, or the rod for a strip thinner than 0.01 L*.
        gripper
            How it holds the strip: "hinge", as in the paper; clamped, "fixed" as it grasped the flat strip, or
            "turning" as the path says: an R-path, or a table with a column ``angle``.  A clamp is there in statics and
            in falls.
        flatness
            Height of the wrinkles that may be in the flat strip, m: the result's ``flatness_ratio`` compares it with
            that of the lowest ones which the path's push makes grow.
        table_friction
            Coefficient of friction of the table that alone holds what lies, and lets it slide.  Its end is pinned
            where it is not given.
        curl
            Curvature of the strip without forces, 1/m, positive where the ends of what lies would curl up.
        bending_test
            File with the table of a bending test of the cloth, its law in place of eta_b's: ``curvature``, 1/m,
            ``moment`` per width, N, and ``unloading``, N, from which its M_0 is, where it is known.

        Raises
        ------
        InvalidInputError
            A value that cannot be used, or a path for a strip of another length.
        SolveError
            Statics that could not be computed.  A fall that could not be is said in the result's ``failure``.
        """
        from stripfold.ask.inputs import PathInputs

        self._check(path)
        if bending_test is not None:
            bending_test = str(file_name("bending_test", bending_test))
        asked = self._asked(PathInputs, locals())
        from stripfold.ask.assess import assess

        return assess(asked, path, progress)

    def _check(self, path: FoldPath) -> None:
        """Raise InvalidInputError: no path, or one for a strip of another length."""
        from stripfold.paths import FoldPath

        if not isinstance(cast(object, path), FoldPath):
            advice = "such as triangular(strip), or read(file, strip) for a table; a plan has one, plan.path"
            raise InvalidInputError("path", path, "a path of stripfold.paths", advice)
        if not isclose(path.length, self.length):
            made_for = f"a path for a length of {path.length:g} m"
            raise InvalidInputError("path", made_for, f"one for this strip's length, {self.length:g} m", "make it anew")

    def _asked(self, model: type[M], arguments: Mapping[str, Any]) -> M:
        """Make the inputs of a question from this strip and the arguments of a method."""
        return model(**asdict(self), **{key: arguments[key] for key in arguments if key in model.model_fields})

    @checked
    def map(self, *, friction_moment: float | None = None, progress: Progress | None = None) -> StabilityMap:
        """The stability map: gripper places that the strip follows, and their distance to those where it snaps.

        For a frictionless strip on the elastica, which has neither thickness nor stretch (docs/map.md).

        Parameters
        ----------
        friction_moment
            M_0, N, of the fabric's bending hysteresis: adds where the strip snaps or lands with it, on the rod, for one
            history; takes longer.

        Raises
        ------
        InvalidInputError
            A strip shorter than 7 or longer than 100 L*, or more friction than 0.25 rho_a g L*^2.
        SolveError
            A boundary or a state could not be computed.
        """
        from stripfold.ask.inputs import MapInputs
        from stripfold.ask.map import StabilityMap

        return StabilityMap.of(self._asked(MapInputs, locals()), progress)

    @checked
    def plan(
        self,
        *,
        path: FoldPath | None = None,
        eta_b_uncertainty: float = 0.2,
        goal: str = "accurate",
        gripper_accuracy: float = 1e-3,
        layer_friction: float = 0.5,
        max_snap: float | None = None,
        max_slide: float | None = None,
        margin: float | None = None,
        tool: float | None = None,
        friction_moment: float | None = None,
        friction_uncertainty: float | None = None,
        yield_curvature: float | None = None,
        speed: float | None = None,
        acceleration: float = 0.5,
        jerk: float | None = None,
        flatness: float = 5e-4,
        table_friction: float | None = None,
        curl: float = 0.0,
        cores: int | None = None,
        progress: Progress | None = None,
    ) -> FoldingPlan:
        """Rank the gripper paths that fold the strip in half by what comes of them (docs/plan.md).

        Parameters
        ----------
        path
            One of yours, ranked among the known ones as "given".
        eta_b_uncertainty
            Relative uncertainty of eta_b.
        goal
            "accurate": the fold whose error has the least upper bound; "gentle": the lowest snap, then the least slide
            of the layers; "quick": the shortest motion.
        gripper_accuracy
            Distance within which the gripper is where it should be, 95 times of 100, m.
        layer_friction
            Largest coefficient of friction between the layers and on the floor.
        max_snap, max_slide, margin, tool
            Limits, m, where given: height by which the strip may snap down, way of the upper layer over the lower one,
            distance of the gripper from where the strip snaps, and length of the tool that has to clear the table.
        friction_moment, yield_curvature
            M_0, N, and kappa_y, 1/m, of the fabric's bending hysteresis, which may hold a strip that snaps without.
        friction_uncertainty
            Relative uncertainty of M_0, by default a tenth.
        speed, acceleration, jerk
            Largest ones of the gripper, m/s, m/s^2 and m/s^3; the jerk is that along the path, unlimited if it is
            not given.  With a speed the best path is followed in time, too; without one it is timed for 0.1 m/s.
        flatness
            Height of the wrinkles that may be in the flat strip, m: a push that makes them grow ranks a path last.
        table_friction
            Coefficient of friction of the table that alone holds what lies; its end is pinned where it is not given.
        curl
            Curvature of the strip without forces, 1/m, positive where the ends of what lies would curl up; margins are
            then not known.
        cores
            Most processes at a time, by default one for each core that may be used; one is the calling one.

        Raises
        ------
        InvalidInputError
            A value that cannot be used, or a strip that cannot be folded in half.
        NoPathError
            No path keeps the limits that are given; it says why not of each.
        """
        from stripfold.ask.inputs import PlanInputs
        from stripfold.ask.plan import FoldingPlan

        if path is not None:
            self._check(path)
        return FoldingPlan.of(self._asked(PlanInputs, locals()), progress, path, cores)
