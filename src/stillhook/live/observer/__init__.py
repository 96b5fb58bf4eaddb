"""The running twin next to what the crane measures: deviations, alarms, estimates, and friction that follows."""

from stillhook.live.observer.observed import ObservedTwin, columns
from stillhook.live.observer.settings import AdaptSettings, ObserverSettings

__all__ = ["AdaptSettings", "ObservedTwin", "ObserverSettings", "columns"]
