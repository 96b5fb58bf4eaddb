"""A crane written without the twin's laws, and what `stillhook validate` makes of its campaigns."""
