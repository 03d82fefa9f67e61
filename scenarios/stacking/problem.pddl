; A tower on amber, where it stands: blue, coral, denim. Objects are those of the scenario file, by name.
(define (problem tower)
  (:domain stacking)
  (:objects amber blue coral denim - block)
  (:init (on amber bench) (on blue bench) (on coral bench) (on denim bench))
  (:goal (and (on blue amber) (on coral blue) (on denim coral))))
