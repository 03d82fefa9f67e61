; The blank stands on the table but out of reach; it should come to rest on the pedestal, and the rake back on the table.
(define (problem put-blank-on-pedestal)
  (:domain lgp)
  (:objects
    pedestal - physobj
    rake - movable
    blank - throwable)
  (:init
    (inworkspace table)
    (inworkspace pedestal)
    (inworkspace rake)
    (on rake table)
    (on blank table))
  (:goal (and
    (not (inhand rake))
    (not (inhand blank))
    (on rake table)
    (on blank pedestal))))
