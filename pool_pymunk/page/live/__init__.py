"""This package is the live table: a page on which one aims and shoots, and the server behind it.

The page keeps where the balls lie, and sends it with every shot; the server keeps nothing. So a
second tab, a lost connection or a new start of the server harm nobody.
It needs ``pip install 'pool-pymunk[play]'``.
"""
