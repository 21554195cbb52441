# hexload_warnings(<target>): the project's warning list for gcc and clang, C and C++; errors with
# HEXLOAD_WARNINGS_AS_ERRORS, which a project that contains this one leaves off: its compiler may know other warnings.
# Enumeration constants are plain numbers here, so a formula may have one beside a floating-point number.
function(hexload_warnings target)
    target_compile_options(${target} PRIVATE
        $<$<BOOL:${HEXLOAD_WARNINGS_AS_ERRORS}>:-Werror>
        -Wall -Wextra -Wpedantic -Wshadow -Wconversion -Wsign-conversion -Wdouble-promotion
        -Wcast-align -Wcast-qual -Wformat=2 -Wundef -Wunused -Wnull-dereference
        $<$<COMPILE_LANG_AND_ID:C,Clang>:-Wno-enum-float-conversion>
        $<$<COMPILE_LANGUAGE:C>:-Wstrict-prototypes -Wmissing-prototypes -Wold-style-definition -Wvla>
        $<$<COMPILE_LANGUAGE:CXX>:-Wold-style-cast -Wnon-virtual-dtor -Woverloaded-virtual>)
endfunction()
