"""Elements of a lowering below its winch, a module each: records, equations of a step, work."""
