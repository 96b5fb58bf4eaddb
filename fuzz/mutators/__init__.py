"""How an input is changed: by its bytes, its tokens or its values, with checksums made to fit again."""
