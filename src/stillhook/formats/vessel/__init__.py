"""Motion transfer functions (RAO) as programs write them."""
