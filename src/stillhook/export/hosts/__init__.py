"""A crane's winch in programs that have vessel, wire and load: OrcaFlex and SIMO."""

from stillhook.export.hosts.exchange import Answer, Exchange, Sample
from stillhook.export.hosts.package import HOSTS, host_source, write_host

__all__ = ["HOSTS", "Answer", "Exchange", "Sample", "host_source", "write_host"]
