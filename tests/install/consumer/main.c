/* Prints the version of the library. */
#include <esvr/esvr.h>
#include <stdio.h>

int main(void) { return printf("%s\n", esvr_version()) < 0; }
