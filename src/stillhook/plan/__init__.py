"""In which weather may this lift be done, what limits it, how long will we wait, and what does a better controller buy?"""
