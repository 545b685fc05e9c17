/* The table field.bin, in flash. */
    .section .rodata.table, "a"
    .globl table_start
    .globl table_end
    .balign 4
table_start:
    .incbin "field.bin"
table_end:
    .byte 0
    .section .note.GNU-stack, ""
