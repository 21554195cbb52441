# hexload_count_coverage(<target>): with HEXLOAD_COVERAGE, clang counts in <target> which lines, branches and conditions run.
# Each program that links it writes a .profraw file when it ends: where LLVM_PROFILE_FILE says, by default where nobody looks.
option(HEXLOAD_COVERAGE "Count what runs of the firmware; needs clang 18 or newer" OFF)
function(hexload_count_coverage target)
    if(HEXLOAD_COVERAGE)
        set(counting "-fprofile-instr-generate=${PROJECT_BINARY_DIR}/profiles/other/%m.profraw" -fcoverage-mapping -fcoverage-mcdc)
        target_compile_options(${target} PRIVATE ${counting})
        target_link_options(${target} INTERFACE -fprofile-instr-generate)
    endif()
endfunction()
