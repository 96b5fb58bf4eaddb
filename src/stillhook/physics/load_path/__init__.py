"""From drum to payload: wire layers, rope, hook load, and a payload in water."""
