"""A3C as published (Mnih et al., 2016; Zhu et al., 2017): asynchronous workers in processes on shared memory."""
