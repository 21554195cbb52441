# Provides the target unity::framework, the Unity test framework for C (2.4.3 or newer). Looked for in this order:
#   1. an installed package, find_package(unity)
#   2. UNITY_ROOT, cache or environment: a folder with src/unity.c and src/unity.h; the default is build/deps/unity,
#      where tools/hexload puts it
#   3. with HEXLOAD_FETCH_UNITY=ON, a pinned release from its public repository
option(HEXLOAD_FETCH_UNITY "Download the Unity test framework when it is not found" OFF)
if(DEFINED ENV{UNITY_ROOT})
    set(unity_root_default "$ENV{UNITY_ROOT}")
else()
    set(unity_root_default "${CMAKE_CURRENT_LIST_DIR}/../../build/deps/unity")
endif()
set(UNITY_ROOT "${unity_root_default}" CACHE PATH "Folder of the Unity test framework (has src/unity.c)")

find_package(unity QUIET CONFIG)

if(NOT TARGET unity::framework)
    if(EXISTS "${UNITY_ROOT}/src/unity.c")
        add_library(unity STATIC "${UNITY_ROOT}/src/unity.c")
        target_include_directories(unity SYSTEM PUBLIC "${UNITY_ROOT}/src")
    elseif(HEXLOAD_FETCH_UNITY)
        include(FetchContent)
        FetchContent_Declare(unity
            GIT_REPOSITORY https://github.com/ThrowTheSwitch/Unity.git
            GIT_TAG 860062d51b2e8a75d150337b63ca2a472840d13c) # v2.6.0
        FetchContent_MakeAvailable(unity)
    else()
        message(FATAL_ERROR
            "Unity test framework: found no src/unity.c in UNITY_ROOT (${UNITY_ROOT}) and no installed package unity. "
            "Run tools/hexload test once, it fetches Unity into build/deps/unity; or set UNITY_ROOT to a folder that has "
            "src/unity.c; or configure with -DHEXLOAD_FETCH_UNITY=ON.")
    endif()
    target_compile_definitions(unity PUBLIC UNITY_INCLUDE_DOUBLE=) # empty, as a unity_config.h may define it too
    if(NOT TARGET unity::framework)
        add_library(unity::framework ALIAS unity)
    endif()
endif()
