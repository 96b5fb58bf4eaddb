"""Synthetic validation campaigns: logs of a reference crane with known parameters and, on request, a defect.

No full-scale log of a heave-compensated crane is public. `write_campaign` lets the reference plant
(`stillhook.winches.reference.plant`) go through the tests of Moslatt 2020 paper F and writes what its PLC would log.
A winch type without a reference plant goes through them by the twin's own equations, with hidden deviations: that tests
the procedure, not the physics. Everything that it writes is marked SYNTHETIC.
"""

from stillhook.validate.synthetic.defects import Defect, defect_of
from stillhook.validate.synthetic.own import trials, write_campaign
from stillhook.validate.synthetic.schedule import Plan, sea_trials
from stillhook.validate.synthetic.writer import WrittenCampaign

__all__ = ["Defect", "Plan", "WrittenCampaign", "defect_of", "sea_trials", "trials", "write_campaign"]
