"""What is kept so that it need not be made again: in memory, and in files, which are not believed where they are
damaged."""
