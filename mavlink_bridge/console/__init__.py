"""The console: one page with fence, plan, rover and verdict, and the server behind it.

`view` makes what is shown of what is known, without any web library; `wire` says what goes over the network, `control` and `stream` decide
who may do what and who is to be told what, clock-free; `app` and `server` are the shell with the web libraries.
"""
