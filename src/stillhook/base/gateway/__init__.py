"""The one way in for files that a user brings: opened and read within a budget (`budget`), parsed within it (`parse`),
and whatever a reader does not expect becomes one line of its error (`guard`)."""
