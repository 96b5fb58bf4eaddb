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

import stillhook.kernels.by_numba  # noqa: F401, Numba takes scalar functions from here on
from benchmarks.cases import Sample, crane
from stillhook import Scenario
from stillhook.engine.inputs import CycleInputs
from stillhook.engine.pack.winch import pack
from stillhook.engine.scenario.run import Ready, ScenarioBlock
from stillhook.kernels.build import driver
from stillhook.kernels.lanes import access, paths
from stillhook.physics.friction import bristle_rate
from stillhook.physics.records import replace
from stillhook.physics.scalar import STRICT
from stillhook.winches.records import Tip

Array = NDArray[np.float64]
RTOL = 1.0e-4
NEVER = 2**62
"""Cycle that windows begin at: none."""
SCALES = (1.0, 10.0, 1.0, 10.0, 1.0, 10.0, 1.0, 10.0, 1.0e7, 1.0e7, 0.1, 100.0, 1.0e-2, 1.0, 1.0, 1.0)
"""Typical size of each state of the active/passive winch; absolute tolerances are RTOL times these. RTOL gives the wire
of a 2.8 m sine to about 0.1 mm, as our 5 ms step does."""


class SolverRun:
    """One trajectory through solve_ivp; `compiled` chooses between machine code and plain Python for the right-hand
    side; the PLC is the kernel's."""

    def __init__(self, case: Scenario, *, compiled: bool) -> None:
        c = crane()
        self.drive = CycleInputs(c, case)
        self.case, self.d = case, driver(c.plant.value, 1)
        self.block = ScenarioBlock([Ready(c, case, pack(c, case), self.drive)], lanes=1, n_sub=1, every=0)
        self.A = self.block.A.reshape(-1)
        self.n_x = self.block.n_x
        self.rhs = _right_hand_side(self.d, compiled)
        self.s_w: list[float] = []

    def go(self, method: str) -> Sample:
        """Errors: RuntimeError where the solver gives up."""
        rows = self.drive.rows(0, self.drive.n_ticks + 1)
        dt, at = self.drive.t_cycle, paths(self.d.State).index(".path.s_w")
        atol = RTOL * np.array(SCALES)
        wall, cpu = perf_counter(), process_time()
        for k in range(self.drive.n_ticks):
            self.observe(k, rows[k])
            c = quintic(rows[k], rows[k + 1], dt)
            x = solve_ivp(
                self.rhs, (0.0, dt), self.A[: self.n_x].copy(), method, args=(self.A, c), rtol=RTOL, atol=atol
            )
            if not x.success:
                raise RuntimeError(x.message)
            self.A[: self.n_x] = x.y[:, -1]
            self.s_w.append(float(self.A[at]))
        return Sample(self.case.duration, perf_counter() - wall, process_time() - cpu)

    def observe(self, k: int, row: Array) -> None:
        """PLC cycle k on the lane."""
        b, out = self.block, self.block.out.reshape(-1)
        self.d.run(self.A, row, len(row), b.H, b.W, out, b.lost, 0, k, 0, NEVER, k, b.n_win, 1, self.drive.t_cycle)


def quintic(a: Array, b: Array, dt: float) -> Array:
    """Coefficients of the tip's position over a cycle, through s, v, a at both ends."""
    d, v_0, a_0, v_1, a_1 = b[0] - a[0], a[1] * dt, a[2] * dt**2 / 2.0, b[1] * dt, b[2] * dt**2 / 2.0
    c_3 = 10.0 * d - 6.0 * v_0 - 4.0 * v_1 - 3.0 * a_0 + a_1
    c_4 = -15.0 * d + 8.0 * v_0 + 7.0 * v_1 + 3.0 * a_0 - 2.0 * a_1
    c_5 = 6.0 * d - 3.0 * v_0 - 3.0 * v_1 - a_0 + a_1
    scaled: Array = np.array([a[0], v_0, a_0, c_3, c_4, c_5]) / dt ** np.arange(6)
    return scaled


@functools.cache
def _right_hand_side(d: Any, compiled: bool) -> Callable[..., Any]:
    """f(t, x, A, c), made of the plant's own functions."""
    load, get, put = access(d.Lane, 1).load, access(d.State, 1).load, access(d.State, 1).store
    with_winch, with_z = replace(d.State, "winch"), replace(d.plant.State, "z")
    circuit, rates, path_point = d.plant.circuit, d.rates, d.path_point

    def rhs(t: float, x: Array, A: Array, c: Array) -> Array:
        b, y = load(A, 0), get(x, 0)
        s = c[0] + t * (c[1] + t * (c[2] + t * (c[3] + t * (c[4] + t * c[5]))))
        v = c[1] + t * (2.0 * c[2] + t * (3.0 * c[3] + t * (4.0 * c[4] + t * 5.0 * c[5])))
        u, tip, w = b.u_0 if t < b.p.plc.t_compute else b.u, Tip(s, v), y.winch
        now = circuit(w, path_point(y, b.geo, tip, b.p), u, b.geo, b.p)
        z_dot = bristle_rate(w.omega_m, w.z, now.g, now.held, b.p.hoist.bristle)
        x_dot = rates(y, u, b.geo, tip, b.p)
        out = np.empty(len(x))
        put(out, 0, with_winch(x_dot, with_z(x_dot.winch, z_dot)))
        return out

    return njit(**STRICT)(rhs) if compiled else rhs
