# Bare-metal Arm with arm-none-eabi-gcc; HEXLOAD_CORE names the core. The presets target-* use it.
set(HEXLOAD_CORE cortex-m7 CACHE STRING "cortex-m7, cortex-m4f or cortex-r5f")
set(HEXLOAD_CORE_FLAGS_cortex-m7 "-mcpu=cortex-m7 -mthumb -mfpu=fpv5-sp-d16 -mfloat-abi=hard")
set(HEXLOAD_CORE_FLAGS_cortex-m4f "-mcpu=cortex-m4 -mthumb -mfpu=fpv4-sp-d16 -mfloat-abi=hard")
set(HEXLOAD_CORE_FLAGS_cortex-r5f "-mcpu=cortex-r5 -mthumb -mfpu=vfpv3-d16 -mfloat-abi=hard")
if(NOT DEFINED HEXLOAD_CORE_FLAGS_${HEXLOAD_CORE})
    message(FATAL_ERROR "HEXLOAD_CORE: found ${HEXLOAD_CORE}, expected cortex-m7, cortex-m4f or cortex-r5f")
endif()

set(CMAKE_SYSTEM_NAME Generic)
set(CMAKE_SYSTEM_PROCESSOR arm)
set(CMAKE_C_COMPILER arm-none-eabi-gcc)
set(CMAKE_CXX_COMPILER arm-none-eabi-g++)
set(CMAKE_TRY_COMPILE_TARGET_TYPE STATIC_LIBRARY) # a program needs a port's linker script
list(APPEND CMAKE_TRY_COMPILE_PLATFORM_VARIABLES HEXLOAD_CORE)

# The callgraph files (*.ci) state each function's stack and calls; they do not change the code.
foreach(language C CXX)
    set(CMAKE_${language}_FLAGS_INIT
        "${HEXLOAD_CORE_FLAGS_${HEXLOAD_CORE}} -ffunction-sections -fdata-sections -fcallgraph-info=su,da")
endforeach()
set(CMAKE_EXE_LINKER_FLAGS_INIT "-Wl,--gc-sections")
