"""The browser interface: draw a task, watch it being designed, take the part.

A face beside the command line: it parses, calls and renders, and holds no physics. `app` puts
the pages and the interface of the server together out of the modules named ``*_routes``;
`solving` and `making` are what is computed, each call from plain data to plain data in a process
of `pools`; `jobs` are searches as folders on disk, run by `scheduling` in processes that
`searching` is the whole of. `gallery` lists designs from several sources. The page itself is
written in TypeScript in the folder ``web`` of the repository and built into ``static``.
"""
