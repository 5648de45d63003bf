#pragma once
#define BOOST_SYMBOL_VISIBLE __attribute__((visibility("default")))
#define BOOST_SYMBOL_EXPORT __attribute__((visibility("default")))
