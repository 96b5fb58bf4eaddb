from stillhook.live.condition.follow import Condition as Condition
from stillhook.live.condition.follow import NumberCondition as NumberCondition
from stillhook.live.condition.follow import follow_condition as follow_condition
from stillhook.live.condition.outputs import save_condition as save_condition
