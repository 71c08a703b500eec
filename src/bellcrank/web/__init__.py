"""Browser interface: define a task, follow its search, download the part.

Like the command line it parses requests, calls the layers below and renders results; it contains no
mechanics. `app` assembles the server from the modules named ``*_routes``. `quick_calls` and
`slow_calls` contain the functions that run in the processes of `pools`; their arguments and results
are plain data. `jobs` stores searches as folders, `scheduler` starts them, and `search_process` is
the process of one search. `gallery` lists designs from several sources. The page is written in
TypeScript in the folder ``web`` of the repository and built into ``static``.
"""
