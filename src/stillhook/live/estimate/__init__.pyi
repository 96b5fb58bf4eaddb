from stillhook.live.estimate.accuracy import Accuracies as Accuracies
from stillhook.live.estimate.clock import Clock as Clock
from stillhook.live.estimate.friction import FrictionEstimator as FrictionEstimator
from stillhook.live.estimate.friction import FrictionState as FrictionState
from stillhook.live.estimate.friction import follow_friction as follow_friction
from stillhook.live.estimate.regression import FrictionEstimate as FrictionEstimate
from stillhook.live.estimate.steps import FrictionAlarm as FrictionAlarm
