"""The verbs of ``snowrepro``, a file each: its help, its arguments, and what it does.

A verb's file imports modules, takes nothing out of them until it is executed, and quotes their types: ``..deferred``
says why.
"""
