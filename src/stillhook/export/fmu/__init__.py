"""Functional Mock-up Units of a crane's winch, without Python in them."""

from stillhook.export.fmu.package import FMI_VERSIONS, write_fmu, write_reference
from stillhook.export.fmu.system import write_ssp

__all__ = ["FMI_VERSIONS", "write_fmu", "write_reference", "write_ssp"]
