"""The live twin: beside a PLC in real time, its servers, its history, and what it learns."""
