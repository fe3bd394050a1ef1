"""For Debian 12's ParaView 5.11, which loads no Python plugin in Python 3.11: it looks for a function that is gone."""

import inspect

if not hasattr(inspect, "getargspec"):
    inspect.getargspec = inspect.getfullargspec
