"""An FMU in a host that is not ours, FMPy, and what its signals are compared by."""

from pathlib import Path

import numpy as np
import pytest

from stillhook.export.twin import own_platform

CLOSE = 1e-12
"""Control error that compilers may differ by [m]: the issue's bound."""
RELATIVE = 1e-9
"""Part of a signal's largest value by which it may differ: the issue's bound."""
TIP = ("s_tip", "v_tip", "a_tip")
OWN = own_platform()


class Slave:
    """An FMU in FMPy, by names, whichever its version."""

    def __init__(self, file: Path, folder: Path) -> None:
        fmpy = pytest.importorskip("fmpy", reason="fmpy is of tests/requirements.lock: make check")
        from fmpy.fmi2 import FMU2Slave
        from fmpy.fmi3 import FMU3Slave

        self.description = fmpy.read_model_description(str(file), validate=True)
        self.numbers = {v.name: v.valueReference for v in self.description.modelVariables}
        two = self.description.fmiVersion.startswith("2")
        unzipped = fmpy.extract(str(file), str(folder))
        self.fmu = (FMU2Slave if two else FMU3Slave)(
            guid=self.description.guid,
            unzipDirectory=unzipped,
            modelIdentifier=self.description.coSimulation.modelIdentifier,
            instanceName="one",
        )
        self.messages: list[str] = []
        self.two = two
        self.set_real = self.fmu.setReal if two else self.fmu.setFloat64
        self.get_real = self.fmu.getReal if two else self.fmu.getFloat64
        self.set_int = self.fmu.setInteger if two else self.fmu.setInt32
        self.get_int = self.fmu.getInteger if two else self.fmu.getInt32
        self.fmu.instantiate()

    def begin(self, reals: dict[str, float], integers: dict[str, int]) -> None:
        if self.two:
            self.fmu.setupExperiment(startTime=0.0)
        self.set(**reals)
        self.set_int([self.numbers[n] for n in integers], list(integers.values()))
        self.fmu.enterInitializationMode()
        self.fmu.exitInitializationMode()

    def set(self, **values: float) -> None:
        self.set_real([self.numbers[n] for n in values], list(values.values()))

    def get(self, *names: str) -> list[float]:
        return list(self.get_real([self.numbers[n] for n in names]))

    def text(self, name: str) -> str:
        found = self.fmu.getString([self.numbers[name]])[0]
        return found.decode() if isinstance(found, bytes) else str(found)

    def step(self, time: float, h: float) -> None:
        self.fmu.doStep(currentCommunicationPoint=time, communicationStepSize=h)

    def state(self):
        return self.fmu.getFMUstate() if self.two else self.fmu.getFMUState()

    def saved(self) -> bytes:
        state = self.state()
        return bytes(self.fmu.serializeFMUstate(state) if self.two else self.fmu.serializeFMUState(state))

    def restore(self, data: bytes) -> None:
        if self.two:
            self.fmu.setFMUstate(self.fmu.deSerializeFMUstate(data))
        else:
            self.fmu.setFMUState(self.fmu.deserializeFMUState(data))


def given(row: np.ndarray) -> dict[str, float]:
    return dict(zip(TIP, map(float, row), strict=True))


def same(values: np.ndarray, run, names: tuple[str, ...]) -> None:
    for name, signal in zip(names, values, strict=True):
        true = run[name].values
        assert np.abs(signal - true).max() <= (CLOSE if name == "e_c" else RELATIVE * np.abs(true).max()), name
