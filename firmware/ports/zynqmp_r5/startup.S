// From reset to main() on a Cortex-R5F, and what happens when the processor refuses to go on. Arm Architecture Reference
// Manual ARMv7-A and ARMv7-R, B1 (modes, exceptions) and B6 (system control registers).
    .syntax unified
    .arm

    .set MODE_SYSTEM, 0xDF      // CPSR: system mode, interrupts masked: nothing here uses them
    .set SCTLR_V, 1 << 13       // vectors at 0xFFFF0000 instead of 0
    .set CPACR_CP10_CP11, 0xF << 20
    .set FPEXC_EN, 1 << 30
    .set PAINT, 0xA5A5A5A5      // as in stack.c

    .section .vectors, "ax"
    .global vectors
vectors:
    ldr pc, =reset
    b undefined_instruction
    b supervisor_call
    b prefetch_abort
    b data_abort
    b unused
    b interrupt
    b fast_interrupt

// Each leaves its number and the address of the cause to report_fault(), on a stack of its own: the fault may be that of
// the program's.
    .macro fault name, number, offset
\name:
    mov r0, #\number
    sub r1, lr, #\offset
    b stop
    .endm
    fault undefined_instruction, 1, 4
    fault supervisor_call, 2, 4
    fault prefetch_abort, 3, 4
    fault data_abort, 4, 8
    fault unused, 5, 4
    fault interrupt, 6, 4
    fault fast_interrupt, 7, 4
stop:
    cps #0x1F
    ldr sp, =fault_stack_top
    bl report_fault
    b .

    .section .text.reset, "ax"
    .global reset
    .type reset, %function
reset:
    msr cpsr_c, #MODE_SYSTEM
    mrc p15, 0, r0, c1, c0, 0
    bic r0, r0, #SCTLR_V
    mcr p15, 0, r0, c1, c0, 0
    isb

    mrc p15, 0, r0, c1, c0, 2
    orr r0, r0, #CPACR_CP10_CP11
    mcr p15, 0, r0, c1, c0, 2
    isb
    mov r0, #FPEXC_EN
    vmsr fpexc, r0
    mov r0, #0                  // round to nearest, subnormal numbers kept: the host's arithmetic
    vmsr fpscr, r0

    ldr r0, =data_start
    ldr r1, =data_end
    ldr r2, =data_load
1:  cmp r0, r1
    ldrlo r3, [r2], #4
    strlo r3, [r0], #4
    blo 1b

    ldr r0, =bss_start
    ldr r1, =bss_end
    mov r2, #0
2:  cmp r0, r1
    strlo r2, [r0], #4
    blo 2b

    ldr r0, =stack_bottom
    ldr r1, =stack_top
    ldr r2, =PAINT
3:  cmp r0, r1
    strlo r2, [r0], #4
    blo 3b

    ldr sp, =stack_top
    bl main
    b .
    .ltorg
