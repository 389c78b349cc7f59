"""The flow: the state after a span of time as a function of the state before it, with its derivative.

What follows motions through a parameter, or seeks one that repeats, calls it thousands of times. Its answer is
smooth in everything given, as long as the sequence of phases is the same. Each kind of pad has one file or folder.
"""
