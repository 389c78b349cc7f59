"""The equations of motion themselves: phases, the first event in each, and a block of disturbances beside it.

`advance` carries the block of a motion through time, whatever propagates it within a phase.
"""
