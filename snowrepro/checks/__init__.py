"""Does the program still give what it gave, and what it promises?  ``snowrepro check``, in five tiers.

0 ``invariances``: what must hold of any solver of these laws; 1 ``fingerprints``: the same bits as the reference;
2 ``horizon``: within what rounding does; 3 ``ensemble``: the same numbers over seeds; 4 ``verdicts``: the same claims.
``baseline`` keeps the references, ``mutants`` shows that the tiers notice defects.
"""
