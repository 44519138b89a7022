"""Work spread over processes of this machine or a Ray cluster: what rendering, encoding and jobs have in common.

`workers` says what work is and gives workers for it; they stand in `processes` or `on_ray`. `worker` is what each of
them does.
"""
