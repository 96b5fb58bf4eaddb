"""Step 1: do the crane file's parameters agree with those implied by the logs?"""
