"""Figures of every result, as matplotlib figures: a notebook shows them, `figure.savefig("run.png")` writes them.

What `simulate`, `analysis.operability_map` and the like give has the same by `run.stillhook.plot()`.

>>> import stillhook
>>> crane = stillhook.load_crane("nov-250t")
>>> case = stillhook.Scenario(load="100 t", s_w="100 m", tip="sine 1 m 12 s", duration="40 s", warm_up="20 s")
>>> run = stillhook.simulate(crane, case)
>>> [ax.get_ylabel().split(" [")[0] for ax in stillhook.plot.run(run).axes]
['wire speed', 'A-side pressure', 'control error', 'displacement']
"""

from stillhook.base.lazy import public

__getattr__, __dir__, __all__ = public(__name__)
