"""The same winch in `scipy.integrate.solve_ivp`: what it takes to follow it with a general-purpose solver.

The PLC acts every cycle, so the solver is called cycle by cycle with the commands held. The bristle is one of the
differential equations here (`bristle_rate`), where the engine advances it exactly.
"""

import functools
from collections.abc import Callable
from time import perf_counter, process_time
from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from benchmarks.cases import Sample, crane
from stillhook import Scenario
from stillhook.engine.inputs import CycleInputs
from stillhook.engine.pack.winch import pack
from stillhook.engine.scenario.run import Ready, ScenarioBlock
from stillhook.kernels.build import driver
from stillhook.kernels.lanes import access, offset
from stillhook.physics.friction import bristle_rate
from stillhook.physics.records import replace
from stillhook.physics.scalar import STRICT
from stillhook.winches.records import THIN, Tip

Array = NDArray[np.float64]
RTOL = 1.0e-4
SCALES = (1.0, 10.0, 1.0, 10.0, 1.0, 10.0, 1.0, 10.0, 1.0e7, 1.0e7, 0.1, 100.0, 1.0, 1.0e-2, 1.0, 1.0)
"""Typical size of each state of the active/passive winch; absolute tolerances are RTOL times these. RTOL gives the wire
of a 2.8 m sine to about 0.1 mm, as our 5 ms step does."""


class SolverRun:
    """One trajectory through solve_ivp; `compiled` chooses between machine code and plain Python for the right-hand
    side."""

    def __init__(self, case: Scenario, *, compiled: bool) -> None:
        c = crane()
        self.drive = CycleInputs(c, case)
        self.case, self.d = case, driver(c.plant.value, 1)
        self.block = ScenarioBlock([Ready(c, case, pack(c, case), self.drive)], lanes=1, n_sub=1, every=0)
        self.A = self.block.A.reshape(-1)
        self.n_x = self.block.n_x
        self.rhs, self.observe = _functions(self.d, compiled)
        self.s_w: list[float] = []

    def go(self, method: str) -> Sample:
        """Errors: RuntimeError where the solver gives up."""
        rows = self.drive.rows(0, self.drive.n_ticks + 1)
        dt, at = self.drive.t_cycle, self.d.State._fields.index("s_w")
        atol = RTOL * np.array(SCALES)
        wall, cpu = perf_counter(), process_time()
        for k in range(self.drive.n_ticks):
            self.observe(self.A, rows[k])
            c = quintic(rows[k], rows[k + 1], dt)
            x = solve_ivp(
                self.rhs, (0.0, dt), self.A[: self.n_x].copy(), method, args=(self.A, c), rtol=RTOL, atol=atol
            )
            if not x.success:
                raise RuntimeError(x.message)
            self.A[: self.n_x] = x.y[:, -1]
            self.s_w.append(float(self.A[at]))
        return Sample(self.case.duration, perf_counter() - wall, process_time() - cpu)


def quintic(a: Array, b: Array, dt: float) -> Array:
    """Coefficients of the tip's position over a cycle, through s, v, a at both ends."""
    d, v_0, a_0, v_1, a_1 = b[0] - a[0], a[1] * dt, a[2] * dt**2 / 2.0, b[1] * dt, b[2] * dt**2 / 2.0
    c_3 = 10.0 * d - 6.0 * v_0 - 4.0 * v_1 - 3.0 * a_0 + a_1
    c_4 = -15.0 * d + 8.0 * v_0 + 7.0 * v_1 + 3.0 * a_0 - 2.0 * a_1
    c_5 = 6.0 * d - 3.0 * v_0 - 3.0 * v_1 - a_0 + a_1
    scaled: Array = np.array([a[0], v_0, a_0, c_3, c_4, c_5]) / dt ** np.arange(6)
    return scaled


@functools.cache
def _functions(d: Any, compiled: bool) -> tuple[Callable[..., Any], Callable[..., None]]:
    """Right-hand side f(t, x, A, c) and the PLC's cycle on A; made of the plant's own functions."""
    state, load, with_z = access(d.State, 1), d.load, replace(d.State, "z")
    get, put = state.load, state.store
    circuit, rates, cycle, tick = d.circuit, d.rates, d.cycle, offset(d.Lane, "tick", 1)

    def rhs(t: float, x: Array, A: Array, c: Array) -> Array:
        b, y = load(A, 0), get(x, 0)
        s = c[0] + t * (c[1] + t * (c[2] + t * (c[3] + t * (c[4] + t * c[5]))))
        v = c[1] + t * (2.0 * c[2] + t * (3.0 * c[3] + t * (4.0 * c[4] + t * 5.0 * c[5])))
        u = b.u_0 if t < b.p.plc.t_compute else b.u
        now = circuit(y, u, b.geo, Tip(s, v), b.p)
        out = np.empty(len(x))
        put(
            out,
            0,
            with_z(rates(now, y, u, b.geo, b.p), bristle_rate(y.omega_m, y.z, now.g, now.held, b.p.hoist.bristle)),
        )
        return out

    def observe(A: Array, row: Array) -> None:
        for i in range(THIN):
            A[tick + i] = row[i]
            A[tick + THIN + i] = row[i]
        cycle(A, 1.0)

    if not compiled:
        return rhs, observe
    return njit(**STRICT)(rhs), njit(**STRICT)(observe)
