# Keys of boards that have no key store: in the image.
set(HEXLOAD_KEY_FILE "" CACHE FILEPATH "Key of the boards' programs (hexload key new): commands of who has it alone")
option(HEXLOAD_WITHOUT_AUTHENTICATION "Boards' programs without a key, which take commands of anybody on the bus" OFF)
set(MBEDTLS_ROOT "${PROJECT_SOURCE_DIR}/build/deps/mbedtls" CACHE PATH "Sources of mbedTLS, for boards")

# hexload_give_key(<target> <key file>): ports/boot/built_key.h for a board's program; without a file it has no key, which
# must be wanted.
function(hexload_give_key target key)
    target_sources(${target} PRIVATE "${PROJECT_SOURCE_DIR}/firmware/ports/boot/built_key.c")
    if(NOT key)
        if(NOT HEXLOAD_WITHOUT_AUTHENTICATION)
            message(FATAL_ERROR "${target}: found no HEXLOAD_KEY_FILE, expected one, or HEXLOAD_WITHOUT_AUTHENTICATION: "
                "without a key anybody on the bus commands this controller")
        endif()
        return()
    endif()
    find_package(Python 3.11 REQUIRED COMPONENTS Interpreter)
    set(folder "${CMAKE_CURRENT_BINARY_DIR}/${target}.key")
    file(MAKE_DIRECTORY "${folder}")
    add_custom_command(
        OUTPUT "${folder}/hexload_key.h"
        COMMAND "${CMAKE_COMMAND}" -E env "PYTHONPATH=${PROJECT_SOURCE_DIR}/tools/python"
                "${Python_EXECUTABLE}" -m hexload_dev.key_header "${key}" "${folder}/hexload_key.h"
        DEPENDS "${key}"
        COMMENT "Reading the key of ${target}"
        VERBATIM)
    target_sources(${target} PRIVATE "${folder}/hexload_key.h")
    target_include_directories(${target} PRIVATE "${folder}")
    target_compile_definitions(${target} PRIVATE HEXLOAD_HAS_KEY)
    target_link_libraries(${target} PRIVATE hexload::aes128)
endfunction()
