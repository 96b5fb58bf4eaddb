"""Synthetic validation campaigns: logs of a reference crane with known parameters and, on request, a defect.

No full-scale log of a heave-compensated crane is public. `write_campaign` lets the reference plant
(`stillhook.winches.reference.plant`) go through the tests of Moslatt 2020 paper F and writes what its PLC would log.
Everything that it writes is marked SYNTHETIC.
"""

from stillhook.validate.synthetic.defects import Defect, defect_of
from stillhook.validate.synthetic.schedule import Plan, sea_trials
from stillhook.validate.synthetic.writer import WrittenCampaign, write_campaign

__all__ = ["Defect", "Plan", "WrittenCampaign", "defect_of", "sea_trials", "write_campaign"]
