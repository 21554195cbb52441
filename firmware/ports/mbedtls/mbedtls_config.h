/// @file mbedtls_config.h
/// What of mbedTLS is compiled for a board: AES, with its tables in flash and not made in RAM.
#define MBEDTLS_AES_C
#define MBEDTLS_AES_ROM_TABLES
#define MBEDTLS_AES_FEWER_TABLES
