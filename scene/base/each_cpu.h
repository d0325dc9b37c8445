// Plain loops as vector code for the processor at hand.
#pragma once

// Compiles a function for several instruction sets; the one that fits is chosen when the program is loaded. Each gives
// the same bits: products and sums are not fused (-ffp-contract=off, where it is used) and nothing is reassociated.
// Sanitizers do not take functions that are chosen at loading.
#if defined(__x86_64__) && defined(__ELF__) && !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
#define LUMEL_FOR_EACH_CPU __attribute__((flatten, target_clones("avx512f", "avx2", "default")))
#else
#define LUMEL_FOR_EACH_CPU
#endif
