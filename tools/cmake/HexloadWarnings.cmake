# hexload_warnings(<target>): the project's warning list, as errors, for gcc and clang, C and C++.
function(hexload_warnings target)
    target_compile_options(${target} PRIVATE
        -Werror -Wall -Wextra -Wpedantic -Wshadow -Wconversion -Wsign-conversion -Wdouble-promotion
        -Wcast-align -Wcast-qual -Wformat=2 -Wundef -Wunused -Wnull-dereference
        $<$<COMPILE_LANGUAGE:C>:-Wstrict-prototypes -Wmissing-prototypes -Wold-style-definition -Wvla>
        $<$<COMPILE_LANGUAGE:CXX>:-Wold-style-cast -Wnon-virtual-dtor -Woverloaded-virtual>)
endfunction()
