"""Stillhook keeps the hook still: a digital twin of hydraulic active-heave-compensated crane winches.

>>> import stillhook
>>> crane = stillhook.load_crane("nov-250t")
>>> tip = stillhook.Sine(amplitude="2.8 m", period="12 s")
>>> case = stillhook.Scenario(load="100 t", s_w="100 m", tip=tip, mode="ssc")
>>> run = stillhook.simulate(crane, case)
>>> float(run.e_c_pp)  # doctest: +SKIP
"""

from stillhook.base.lazy import after, public

__getattr__, __dir__, __all__ = public(__name__)
after("xarray", "stillhook.plot.accessor")  # run.stillhook
