"""Large messages between processes of one machine: written once, into memory that the others read.

Each publisher of large messages has an `arena`: memory without a file, in which its messages follow one another; when
it is full, a new message overwrites the oldest. What travels through Zenoh is a `place` of forty bytes. The receiving
process (`reader`) opens the arena through `/proc`, copies the message out, and then checks that it was not overwritten
meanwhile; one that was is lost, as it would be in a full queue. So no reader can delay a publisher or take memory from
it, whether it is slow, stopped or killed, and nothing is left behind: the kernel frees the memory with the last process
that has it open.

`neighbours` knows which sessions of the run can read this process's memory. A publisher uses its arena while every
subscription of its topic elsewhere belongs to one of them, and otherwise sends messages whole. So does a process of
another machine, container or user, a client, a node of ROS 2, and every process on a system that is not Linux.
"""
