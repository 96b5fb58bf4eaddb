"""Controllers for a comparison: a motor law (mode) and the settings that it runs with, by name or from a
file.

Published SSC keeps K_p = 0.16 1/m, a sixth of the gain at which the winch would oscillate, and compares the wire with a
tip motion that is older than the command is when it acts. A controller that is to replace SSC has to beat SSC without
these two handicaps: `strong_ssc` has all the position gain that the margins allow, and a reference that is not late.

The same motion under several controllers, side by side.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from pydantic import Field, create_model, field_validator

from stillhook.analysis.kept import kept
from stillhook.base.choice import nearest
from stillhook.base.progress import Progress
from stillhook.control.registry import DEFAULT_MODE, MANUAL_MODE
from stillhook.engine.arguments import checked_cases, cycles
from stillhook.engine.scenario.checks import check
from stillhook.engine.scenario.summary import ScenarioRun
from stillhook.engine.simulate import dataset_of, run_cases, unchanged
from stillhook.errors import ScenarioError, SpecError, StillhookError
from stillhook.library import changed
from stillhook.library.toml.file import TomlTable, read_toml
from stillhook.library.toml.kinds import FileKind
from stillhook.library.write import toml_value
from stillhook.sea.motion.recorded import window_spans
from stillhook.spec.control import Control
from stillhook.spec.crane import Crane
from stillhook.spec.scenario import Mode, Scenario, mode_of
from stillhook.tables.table import Spec
from stillhook.units import quote
from stillhook.variables import WINDOW
from stillhook.winches.registry import WINCH_TYPES

if TYPE_CHECKING:
    import xarray


Changes = Mapping[str, Any]

LONGEST_DELAY = 1.0
"""Delay of the motion signal beyond which holding the tip's acceleration is not an estimate of its motion [s]: an
eighth of a short wave."""

STRONG = "strong-ssc"
PLAIN = {mode.value: mode for mode in Mode if mode.compensates}
NAMES = (*PLAIN, STRONG)
"""Names that `controller` accepts without a file."""
KEPT = ("best classic", "physical")
"""Names of rows of results in addition to the controllers: the better of NS and HS in a map, the machine's own limit in
an envelope."""
LEARNING = 40.0
"""Time that a controller which learns has in addition before a run counts [s]. In regular waves of 8 and 12 s the error
of `ff` from 30 s on is what it is from 300 s on (nov-250t, 50 to 150 t), from 20 s on two to five times that, and from
10 s on up to that of SSC."""
_OF_MOTORS = ("alpha_min", "servo", "variant", "offset", "hysteresis")
"""What a controller's file may set of the motors: the rest belongs to the machine."""


def learning_time(modes: Iterable[Mode]) -> float:
    """Time before runs under these modes count, in addition to their warm-up [s]: `LEARNING` where one learns."""
    return LEARNING if any(mode.law.learns for mode in modes) else 0.0


def _settings(name: str, fields: Iterable[str]) -> type[Spec]:
    """A table of settings, whose values the crane checks."""
    table: dict[str, Any] = dict.fromkeys(fields, (Any, None))
    return create_model(name, __base__=Spec, **table)


ControlSettings = _settings("ControlSettings", Control.model_fields)
MotorSettings = _settings("MotorSettings", _OF_MOTORS)


class ActiveSettings(Spec):
    """The table [active]."""

    motor: MotorSettings | None = Field(default=None, description="settings of the active motors")  # type: ignore[valid-type]


DRIVE_TABLES = sorted({path.partition(".")[0] for winch in WINCH_TYPES.values() for path in winch.tuned})
"""Tables of crane files with settings of a drive, which a controller's file may set too."""


class _ControllerFile(Spec):
    """A controller's file."""

    mode: Mode = Field(description='motor law, such as "ssc"')
    control: ControlSettings | None = Field(default=None, description="settings of the controller")  # type: ignore[valid-type]
    active: ActiveSettings | None = Field(default=None, description="table [active.motor] with settings of the motors")

    @field_validator("mode", mode="before")
    @classmethod
    def _of_motors(cls, mode: object) -> object:
        if not isinstance(mode, str) or mode not in PLAIN:
            raise ValueError(f"not a controller of the motors. Choose one of {', '.join(PLAIN)}.")
        return mode


_of_drives: dict[str, Any] = dict.fromkeys(DRIVE_TABLES, (dict[str, Any] | None, None))
ControllerFile = create_model("ControllerFile", __base__=_ControllerFile, **_of_drives)


@dataclass(frozen=True)
class Controller:
    """How a winch is controlled: `mode` is the law of the motors, `changes` what differs from the crane's own settings.

    name: what tables and pictures call it; changes: nested tables as a crane file has them, ``{"control": {"K_p": "0.3
    1/m"}}``, or the rule that gives them for a crane (strong SSC, whose gain follows from the machine).
    """

    name: str
    mode: Mode
    changes: Changes | Callable[[Crane], Changes] = field(default_factory=dict)

    def __post_init__(self) -> None:
        object.__setattr__(self, "mode", mode_of(self.mode))

    def changes_on(self, crane: Crane) -> Changes:
        """The changes for this crane, worked out where a rule gives them."""
        return self.changes(crane) if callable(self.changes) else self.changes

    def on(self, crane: Crane) -> Crane:
        """The crane with this controller's settings; the crane itself where nothing differs.

        Errors: SpecError, UnitError of one line that names the controller and the field, or says that it is of another
        winch type.
        """
        if reason := crane.plant.type.mode_refusal(self.mode):
            raise SpecError(f'"{crane.name}": {reason}')
        changes = self.changes_on(crane)
        if not changes:
            return crane
        try:
            return changed(crane, changes)
        except StillhookError as problem:
            raise type(problem)(f'controller "{self.name}": {problem}') from None


def controller(name_or_path: str | Path | Controller) -> Controller:
    """A controller by name (`NAMES`), or from a TOML file whose stem becomes its name.

    A file gives the motor law and what differs from the crane, each number with its unit::

        mode = "ssc"
        [control]
        K_p = "0.3 1/m"
        u_thr = 0.5
        [active.motor]
        alpha_min = 0.55

    `level-1` to `ssc-cubic` run with the crane's own settings; `strong-ssc` is SSC with the gain that the margins allow
    and a time-aligned reference (`strong_ssc`).

    Parameters
    ----------
    name_or_path : str, Path or Controller
        Name or file; one that is a controller already is kept.

    Returns
    -------
    Controller
        Mode and what it changes on the crane.

    Raises
    ------
    SpecError
        One line, for a name or a file that is not a controller.
    """
    if isinstance(name_or_path, Controller):
        return name_or_path
    if isinstance(name_or_path, str) and name_or_path in PLAIN:
        return Controller(name_or_path, PLAIN[name_or_path])
    if name_or_path == STRONG:
        return Controller(STRONG, DEFAULT_MODE, strong_changes)
    if not isinstance(name_or_path, (str, Path)):
        raise SpecError(
            f"Unknown controller {quote(name_or_path)}. Give a name ({', '.join(NAMES)}) or the path of a file."
        )
    path = Path(name_or_path)
    if name_or_path == MANUAL_MODE:
        raise SpecError(
            f'"{MANUAL_MODE}" is not a controller: the operator moves the winch. Choose {", ".join(NAMES)}.'
        )
    if path.suffix != ".toml":
        choose = f"Choose {', '.join(NAMES)} or a file that ends in .toml"
        raise SpecError(f"Unknown controller {quote(str(name_or_path))}. {choose}{nearest(str(name_or_path), NAMES)}")
    return _from_file(path)


def usual_controllers(crane: Crane) -> str:
    """Names of the controllers that are compared on this crane where a user names none: "ns,hs,ssc" on a closed
    circuit."""
    return ",".join(crane.plant.type.usual_modes)


def controllers(names: str | Sequence[str | Path | Controller], where: str = "controllers") -> list[Controller]:
    """Several controllers, each once: a list of names, files or objects, or on the command line one text with commas
    between them. where: what they are called in an error. Errors: SpecError of one line."""
    if not isinstance(names, Sequence):
        raise SpecError(f'{where} = {quote(names)}: give a list, such as ["ns", "hs", "ssc"].')
    chosen = [
        controller(n) for n in ([n.strip() for n in names.split(",") if n.strip()] if isinstance(names, str) else names)
    ]
    if not chosen:
        raise SpecError(f"{where} = {quote(names)}: empty; name at least one, such as ns,hs,ssc.")
    labels = [c.name for c in chosen]
    if twice := next((n for n in labels if labels.count(n) > 1), None):
        raise SpecError(
            f'{where}: "{twice}" is named twice. Name each controller once; rename the file of one of them.'
        )
    return chosen


def controller_toml(selected: Controller, crane: Crane, comment: str = "") -> str:
    """The controller as a file that `controller` reads; comment: lines with the sources of its numbers."""
    lines = [f"# {line}".rstrip() for line in comment.splitlines()] + [f"mode = {toml_value(selected.mode.value)}"]
    for path, value in _values(selected.changes_on(crane)):
        *table, name = path
        head = f"[{'.'.join(table)}]"
        if head not in lines:
            lines += ["", head]
        lines.append(f"{name} = {toml_value(value)}")
    return "\n".join(lines) + "\n"


def _values(node: Changes, path: tuple[str, ...] = ()) -> Iterator[tuple[tuple[str, ...], Any]]:
    """Path and plain value of every setting, the values of a table before the tables in it."""
    for key, item in sorted(node.items(), key=lambda pair: isinstance(pair[1], Mapping) and "value" not in pair[1]):
        if isinstance(item, Mapping) and "value" not in item:
            yield from _values(item, (*path, key))
        else:
            yield (*path, key), item["value"] if isinstance(item, Mapping) else item


def _from_file(path: Path) -> Controller:
    if path.stem in KEPT or "$" in path.stem:
        reserved = ", ".join(f'"{name}"' for name in (*KEPT, "$"))
        raise SpecError(
            f"{quote(path.name)}: its name becomes the controller's, and answers keep {reserved} for themselves. Rename"
            " the file."
        )
    start = 'Start it with mode = "ssc", and settings under [control].'
    return read_toml(path, FileKind.CONTROLLER, SpecError, _controller, start=start)


def _controller(table: TomlTable) -> Controller:
    mode = table.read(ControllerFile).mode
    settings = {path for winch in WINCH_TYPES.values() for path in winch.tuned}
    for path, _ in _values({name: table.data[name] for name in DRIVE_TABLES if name in table.data}):
        if ".".join(path) not in settings:
            raise SpecError(
                f"{table.path.name}: {'.'.join(path)}: no setting of a drive. Choose {', '.join(sorted(settings))}."
            )
    return Controller(table.path.stem, mode, {key: value for key, value in table.data.items() if key != "mode"})


def strong_ssc(crane: Crane, *, delay: float = 0.0, command_delay: float = 0.0) -> Controller:
    """SSC with the strongest position gain, its reference aligned in time, for a motion signal that is `delay` [s]
    late and commands that are `command_delay` [s] late.

    K_p: the largest gain that keeps a gain margin of 2, a phase margin of 45 degrees and a sensitivity peak of 2 in the
    complete plant with its PLC on the crane's own wire, from the empty hook to the SWL, from short to all wire, slow to
    fast, at the places that decide (`stillhook.analysis.loop_stability.governing`). Slow and loaded the plant may
    oscillate without feedback; no gain has a margin there. The delay of the motion unit is outside the position loop
    and does not reduce it; that of the commands is inside and does, as is the dead time of the pumps' control. t_lead:
    `lateness` without these two, t_lead_ff: with them. All else is the crane's own.

    Errors: StillhookError for a delay outside 0 to 1 s, and where no gain keeps the margins.
    """
    return Controller(STRONG, DEFAULT_MODE, strong_changes(crane, delay=delay, command_delay=command_delay))


def strong_changes(crane: Crane, *, delay: float = 0.0, command_delay: float = 0.0) -> Changes:
    """What strong SSC changes on this crane, in the form of a crane file; see `strong_ssc`."""
    leads = {"t_lead": lateness(crane, delay=delay)}
    acts = command_delay + crane.plant.type.dead_times(crane).get("u_p", 0.0)
    if acts != 0.0:
        leads["t_lead_ff"] = lateness(crane, delay=delay, command_delay=acts)
    K_p, _ = strong_gain(crane, DEFAULT_MODE, command_delay)
    rounded = math.floor(K_p * 1e4) / 1e4  # down, so that the margins are kept
    texts = {name: f"{1e3 * lead:.4g} ms" for name, lead in leads.items()}
    return {"control": {"K_p": f"{rounded:.4f} 1/m", **texts}}


def strong_gain(crane: Crane, mode: Mode, delay: float = 0.0) -> tuple[float, str]:
    """Largest position gain within the margins [1/m], and the loop that holds; kept between sessions. delay: by which
    commands are late in the loop [s].

    Errors: StillhookError where no gain keeps them.
    """

    def work_out() -> tuple[float, str]:
        from stillhook.analysis.loop_stability.governing import governing  # heavy: it linearises the complete plant

        holds = governing(crane, mode, delay=delay)
        if holds.K_p <= 0.0:
            raise StillhookError(
                f'"{crane.name}": no gain K_p keeps the margins: {holds.describe()}. Choose another controller or'
                " drive."
            )
        return float(holds.K_p), holds.describe()

    late = (repr(delay),) if delay else ()
    return kept(crane, ("strong gain", mode.value, *late), work_out)


def lateness(crane: Crane, *, delay: float = 0.0, command_delay: float = 0.0) -> float:
    r"""Time by which the winch moves later than the measured tip says, once K_2 has made up for the pumps [s].

    .. math:: t_{lead} = t_{delay} + \tfrac12 t_{cycle} + t_{compute} + t_{command} + \frac{2 \zeta_0}{\omega_0}

    A command is held for a cycle, so on the mean it is half a cycle old, and it comes a computing time late. K_2 = K_1
    2 zeta_p / omega_np takes the first-order lag of the pumps. What is left is that of the oil, whose transfer function
    1 / (1 + 2 zeta_0 s / omega_0 + s^2 / omega_0^2) lags by 2 zeta_0 / omega_0 at the slow frequencies of waves; here
    at full displacement, where it is least.

    Parameters: crane; delay of the motion signal, which the PLC is taken to know [s]; command_delay by which commands
    reach the drive later than the PLC writes them, as over a bus [s]. It belongs to the lead of the feedforward alone,
    t_lead_ff: ahead by it the control error would compare the wire with a tip that the wire has no command for yet.
    Errors: StillhookError for a delay outside 0 to 1 s.
    A winch type without closed circuit has no such term.
    Source: linear model of Moslatt 2020 paper C eqs 8 and 9, paper E eq. 17; the thesis extrapolates nothing.
    Valid: leakage also makes the winch slow, in proportion to speed rather than by a time; that is K_1's to make up
    (`stillhook tune`).
    """
    for name, late in (("delay", delay), ("command_delay", command_delay)):
        if not 0.0 <= late <= LONGEST_DELAY:
            raise StillhookError(f"{name} = {late:g} s: allowed is 0 up to {LONGEST_DELAY:g} s.")
    late = delay + 0.5 * crane.control.t_cycle + crane.control.computing + command_delay
    if not crane.plant.type.steady_operation:
        return late
    from stillhook.analysis.loop_stability.stability import eigenfrequency  # heavy: only for strong SSC

    oil = eigenfrequency(crane, 1.0)
    return late + 2.0 * oil.zeta / oil.omega_0


class Comparison(NamedTuple):
    """Runs of one motion under several controllers."""

    crane: Crane
    runs: tuple[ScenarioRun, ...]

    @property
    def ok(self) -> bool:
        """Whether at least one controller stayed inside every limit."""
        return any(r.ok for r in self.runs)

    @property
    def yielding(self) -> tuple[str, ...]:
        """Controllers that give wire on purpose, which their control error holds."""
        return tuple(r.case.mode.value for r in self.runs if r.case.mode.law.yields)

    def table(self) -> dict[str, dict[str, Any]]:
        """Mode -> summary in SI; where a controller gives wire on purpose with load_pp, which all are judged by."""
        more = {r.case.mode.value: {"load_pp": _load_pp(r)} for r in self.runs} if self.yielding else {}
        return {r.case.mode.value: r.summary | more.get(r.case.mode.value, {}) for r in self.runs}

    def dataset(self) -> xarray.Dataset:
        """All runs in one Dataset, case = mode."""
        return dataset_of(self.runs, list(self.table()))


def _load_pp(run: ScenarioRun) -> float:
    """Largest motion of the load against the joystick's path, peak to peak within `WINDOW` after the warm-up [m]."""
    path = run.dt * np.cumsum(run.column("v_op"))
    counted = (run.column("s_load") - path)[round(run.case.warm_up / run.dt) :]
    return float(window_spans(counted, round(WINDOW / run.dt) + 1).max())


def compare(
    crane: Crane,
    case: Scenario,
    modes: Sequence[Mode | str] | None = None,
    *,
    step: str | None = None,
    progress: Progress | None = None,
) -> Comparison:
    """Run one scenario under several controllers, with time series every 0.1 s.

    Parameters
    ----------
    crane : Crane
        The machine.
    case : Scenario
        What is done to it; its own mode is replaced.
    modes : sequence of Mode or str, optional
        Controllers; default the crane's usual ones: NS, HS and SSC on a closed circuit.
    step : str, optional
        Integration step, such as "2 ms"; default as in `stillhook.simulate`.
    progress : callable, optional
        Called with the share done, 0 to 1.

    Returns
    -------
    Comparison
        The runs by mode; `table()` gives their figures.

    Raises
    ------
    ScenarioError
        One line, for an unknown mode, an empty list, or a scenario that is not possible with this crane.

    Examples
    --------
    >>> import stillhook
    >>> crane = stillhook.load_crane("nov-250t")
    >>> case = stillhook.Scenario(load="100 t", s_w="100 m", tip="sine 1 m 12 s", duration="40 s", warm_up="20 s")
    >>> list(stillhook.compare(crane, case, ["ns", "ssc"]).table())
    ['ns', 'ssc']
    """
    checked_cases(crane, case)
    chosen = _chosen(crane.plant.type.usual_modes if modes is None else modes)
    if not isinstance(case, Scenario):
        raise ScenarioError("compare: a list of cases. Give one Scenario, or use simulate.")
    if case.modes:
        raise ScenarioError("modes: a scenario that changes its mode cannot be compared between modes. Use simulate.")
    check(crane, case.with_mode(chosen[0]))
    cases = [case.with_mode(m) for m in chosen]
    runs = run_cases(crane, cases, step=step, every=cycles(crane, None), keep=unchanged, progress=progress)
    return Comparison(crane, tuple(runs))


def _chosen(modes: Sequence[Mode | str]) -> list[Mode]:
    if isinstance(modes, str) or not isinstance(modes, Iterable):
        raise ScenarioError(f'modes = {quote(modes)}: give a list, such as ["ns", "hs", "ssc"].')
    chosen = [mode_of(m) for m in modes]
    if not chosen:
        raise ScenarioError("modes: empty. Give at least one, such as ns,hs,ssc.")
    if twice := next((m for m in chosen if chosen.count(m) > 1), None):
        raise ScenarioError(f'modes: "{twice}" is named twice. Name each mode once.')
    return chosen
