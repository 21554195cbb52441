# hexload_compile_quickly(<source>...): without optimisation. For large template libraries that run once, at the start of a
# program: the optimiser takes half of the time that such a source takes to compile.
function(hexload_compile_quickly)
    set_source_files_properties(${ARGN} PROPERTIES COMPILE_OPTIONS -O0)
endfunction()
