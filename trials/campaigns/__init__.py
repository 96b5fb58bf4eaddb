"""Synthetic campaigns: logs of simulated cranes with known parameters and, on request, a defect.

No full-scale log of a heave-compensated crane is public. `write_campaign` lets the reference plant
(`trials.reference_plant`) go through the tests of Moslatt 2020 paper F and writes what its PLC would log. A winch type
without a reference plant goes through them by the twin's own equations, with hidden deviations: that tests the
procedure, not the physics. `trials.campaigns.friction` writes friction tests, `motor_map` a supplier's map. Everything
that they write is marked SYNTHETIC.

python -m trials.campaigns sea-trials OUT --defect leakage
"""

from trials.campaigns.defects import Defect, defect_of
from trials.campaigns.own import trials
from trials.campaigns.plc_log import WrittenCampaign
from trials.campaigns.schedule import Plan, sea_trials
from trials.campaigns.write import write_campaign

__all__ = ["Defect", "Plan", "WrittenCampaign", "defect_of", "sea_trials", "trials", "write_campaign"]
