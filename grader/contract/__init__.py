"""The assignment's facts: names, interfaces, parameters, layout. What ROS calls things; no judgement, no tools."""
