"""The runtime: points in, states, pose and what is not known out. Needs numpy and `gesturec.artifact` alone."""
