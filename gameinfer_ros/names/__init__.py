"""Constants and text helpers shared by all rooms; this room imports no other one."""
