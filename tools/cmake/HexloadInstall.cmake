# What an installation has beside the core's library and headers: the CMake package hexload with the targets
# hexload::firmware and, where the application is built, hexload::app, hexload::bus and hexload::dbc; hexload.pc and
# hexload_app.pc for pkg-config.
include(GNUInstallDirs)
include(CMakePackageConfigHelpers)

# The application's headers name each other "app/..." and "bus/...": they lie in a folder of their own.
set(HEXLOAD_APP_INCLUDEDIR ${CMAKE_INSTALL_INCLUDEDIR}/hexload_app)
set(HEXLOAD_PACKAGE_SOURCE_DIR "${CMAKE_CURRENT_LIST_DIR}/package")

# hexload_install_with_headers(<folder> <header>...): the library hexload_<folder> as hexload::<folder>.
function(hexload_install_with_headers folder)
    set_target_properties(hexload_${folder} PROPERTIES EXPORT_NAME ${folder})
    install(TARGETS hexload_${folder} EXPORT hexload ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR})
    install(FILES ${ARGN} DESTINATION ${HEXLOAD_APP_INCLUDEDIR}/${folder})
endfunction()

# hexload_install_package(): what find_package and pkg-config find.
function(hexload_install_package)
    set(package_dir ${CMAKE_INSTALL_LIBDIR}/cmake/hexload)
    set(dbc_file ${CMAKE_INSTALL_DATADIR}/hexload/hexload.dbc)
    configure_package_config_file("${HEXLOAD_PACKAGE_SOURCE_DIR}/hexload-config.cmake.in" hexload-config.cmake
        INSTALL_DESTINATION ${package_dir} PATH_VARS dbc_file)
    write_basic_package_version_file(hexload-config-version.cmake COMPATIBILITY SameMinorVersion)
    install(EXPORT hexload NAMESPACE hexload:: FILE hexload-targets.cmake DESTINATION ${package_dir})
    install(FILES "${CMAKE_CURRENT_BINARY_DIR}/hexload-config.cmake" "${CMAKE_CURRENT_BINARY_DIR}/hexload-config-version.cmake"
        DESTINATION ${package_dir})

    # Relative to the file, so that the installation can be moved, and installed to another --prefix.
    file(RELATIVE_PATH to_prefix "/prefix/${CMAKE_INSTALL_LIBDIR}/pkgconfig" "/prefix")
    set(packages hexload)
    if(TARGET hexload_app)
        list(APPEND packages hexload_app)
    endif()
    foreach(package ${packages})
        configure_file("${HEXLOAD_PACKAGE_SOURCE_DIR}/${package}.pc.in" ${package}.pc @ONLY)
        install(FILES "${CMAKE_CURRENT_BINARY_DIR}/${package}.pc" DESTINATION ${CMAKE_INSTALL_LIBDIR}/pkgconfig)
    endforeach()
endfunction()
