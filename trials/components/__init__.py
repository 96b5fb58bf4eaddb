"""Do the intervals of components identified from data of their own hold the truth?"""
