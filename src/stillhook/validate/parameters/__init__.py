"""Step 1: do the crane file's parameters agree with what the logs imply?"""
