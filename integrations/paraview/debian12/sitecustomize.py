"""Makes ParaView 5.11 of Debian 12 load plugins in Python.

It calls inspect.getargspec, which Python 3.11 does not have. Put this folder on PYTHONPATH for ParaView only.
"""
import inspect

if not hasattr(inspect, "getargspec"):
    inspect.getargspec = inspect.getfullargspec
