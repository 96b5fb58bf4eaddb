"""The sensor that a scenario puts between winch and PLC: delay, offset, drift, noise, smallest step, and faults.

It follows the contract of sensors (`stillhook.control.interface`) for every quantity, with the same two functions. Its
noise is pseudo-random and a pure function of what it remembers: the same seed gives the same bits, alone or in lanes,
saved and restored.
"""

from typing import NamedTuple

from stillhook.physics.scalar import ceil, fmax, quantise, scalar

HOUR = 3600.0
"""Time in which the drift of a setting comes [s]."""
FAULTS, RING = 4, 20
"""Faults that a sensor can have in a run, and PLC cycles by which it can be late."""
MODULUS, FACTOR = 2147483647.0, 16807.0
"""Generator of Park and Miller (1988): x' = FACTOR x mod MODULUS, exact in doubles; period 2^31 - 2."""
NEVER = 1.0e300
"""Time of a fault that does not come [s]."""


class Fault(NamedTuple):
    """From `time` to `until` [s] the signal is what it was last where it is frozen (1), else gain times what it would
    be, and value, and rate times the time since; in one cycle of `every` where that is not 0 (a spike). lost 1 where
    its channel says that it is bad."""

    time: float
    until: float
    frozen: float
    value: float
    gain: float = 0.0
    rate: float = 0.0
    every: float = 0.0
    lost: float = 0.0


NO_FAULT = Fault(NEVER, NEVER, 0.0, 0.0)


class Settings(NamedTuple):
    """Errors of one signal in its SI unit: offset, drift in an hour, sd of white noise, smallest step (0: none); delay
    [s]; seed from 1 to MODULUS - 1; faults in the order in which a later one counts."""

    offset: float
    drift: float
    noise: float
    step: float
    delay: float
    seed: float
    fault_0: Fault
    fault_1: Fault
    fault_2: Fault
    fault_3: Fault


class Ring(NamedTuple):
    """True values of the last cycles, the newest first."""

    x_1: float
    x_2: float
    x_3: float
    x_4: float
    x_5: float
    x_6: float
    x_7: float
    x_8: float
    x_9: float
    x_10: float
    x_11: float
    x_12: float
    x_13: float
    x_14: float
    x_15: float
    x_16: float
    x_17: float
    x_18: float
    x_19: float
    x_20: float


class Memory(NamedTuple):
    """Cycles since the start; state of the noise; last signal; true values of the last cycles; lost 1 while its channel
    says that it is bad."""

    n: float
    state: float
    held: float
    ring: Ring
    lost: float


@scalar
def begin(true, s):
    """At rest: the value was there long enough for every delay."""
    ring = Ring(
        true, true, true, true, true, true, true, true, true, true,
        true, true, true, true, true, true, true, true, true, true,
    )  # fmt: skip
    return Memory(n=0.0, state=s.seed, held=true, ring=ring, lost=0.0)


@scalar
def following(x):
    """State of the generator after x."""
    product = FACTOR * x
    return product + MODULUS * ceil(-product / MODULUS)


@scalar
def four(x):
    """Sum of the next four states, exact in doubles, and the last of them."""
    x_1 = following(x)
    x_2 = following(x_1)
    x_3 = following(x_2)
    x_4 = following(x_3)
    return x_1 + x_2 + x_3 + x_4, x_4


@scalar
def normal(x):
    """A pseudo-random number of mean 0 and standard deviation 1, and the state after it: the sum of twelve uniform
    ones, which has no value beyond 6 and a kurtosis of 2.9."""
    a, x_4 = four(x)
    b, x_8 = four(x_4)
    c, x_12 = four(x_8)
    return (a + b + c) / MODULUS - 6.0, x_12


@scalar
def share(d, i):
    """Weight of the value of i cycles ago in a signal that is late by d cycles: straight between two cycles [-]."""
    return fmax(0.0, 1.0 - abs(d - i))


@scalar
def late(true, r, d):
    """The true value of d cycles ago, from 0 to RING."""
    a = share(d, 0.0) * true + share(d, 1.0) * r.x_1 + share(d, 2.0) * r.x_2 + share(d, 3.0) * r.x_3
    b = share(d, 4.0) * r.x_4 + share(d, 5.0) * r.x_5 + share(d, 6.0) * r.x_6 + share(d, 7.0) * r.x_7
    c = share(d, 8.0) * r.x_8 + share(d, 9.0) * r.x_9 + share(d, 10.0) * r.x_10 + share(d, 11.0) * r.x_11
    e = share(d, 12.0) * r.x_12 + share(d, 13.0) * r.x_13 + share(d, 14.0) * r.x_14 + share(d, 15.0) * r.x_15
    f = share(d, 16.0) * r.x_16 + share(d, 17.0) * r.x_17 + share(d, 18.0) * r.x_18 + share(d, 19.0) * r.x_19
    return a + b + c + e + f + share(d, 20.0) * r.x_20


@scalar
def pushed(true, r):
    """The ring with the value of this cycle."""
    return Ring(
        true, r.x_1, r.x_2, r.x_3, r.x_4, r.x_5, r.x_6, r.x_7, r.x_8, r.x_9,
        r.x_10, r.x_11, r.x_12, r.x_13, r.x_14, r.x_15, r.x_16, r.x_17, r.x_18, r.x_19,
    )  # fmt: skip


@scalar
def with_fault(read, held, t, h, fault):
    """A signal with one fault."""
    wrong = held if fault.frozen > 0.5 else fault.gain * read + fault.value + fault.rate * (t - fault.time)
    cycle, every = quantise((t - fault.time) / h, 1.0), fault.every
    hit = every < 0.5 or cycle + every * ceil(-cycle / fmax(every, 1.0)) == 0.0
    return wrong if t >= fault.time and t < fault.until and hit else read


@scalar
def lost(before, t, fault):
    """1 where a fault of the list says that the channel is bad, 0 where one says that it is not, else as before it."""
    return fault.lost if t >= fault.time and t < fault.until else before


@scalar
def reading(true, h, s, m):
    """The signal, and what is remembered: the late value with offset, drift and noise, in steps; then faults.

    A frozen signal stands at what was read last. Time counts from the first cycle.
    """
    t = m.n * h
    noise, state = normal(m.state)
    read = quantise(late(true, m.ring, s.delay / h) + s.offset + s.drift * (t / HOUR) + s.noise * noise, s.step)
    read = with_fault(read, m.held, t, h, s.fault_0)
    read = with_fault(read, m.held, t, h, s.fault_1)
    read = with_fault(read, m.held, t, h, s.fault_2)
    read = with_fault(read, m.held, t, h, s.fault_3)
    bad = lost(lost(lost(lost(0.0, t, s.fault_0), t, s.fault_1), t, s.fault_2), t, s.fault_3)
    return read, Memory(n=m.n + 1.0, state=state, held=read, ring=pushed(true, m.ring), lost=bad)
