"""TOML files of cranes and parameters: trees of values with their sources, kinds of files, errors in one line."""
