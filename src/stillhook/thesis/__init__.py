"""Figures and tables of Moslatt's thesis (2020), drawn again: one function each, grouped as the papers group them."""
