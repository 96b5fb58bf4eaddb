"""A crane's controller as IEC 61131-3 Structured Text and PLCopen XML, translated from the equations that simulate."""

from stillhook.export.plc.block import PlcError, controller_block
from stillhook.export.plc.text import checksum, structured_text, verify

__all__ = ["PlcError", "checksum", "controller_block", "structured_text", "verify"]
