; The crate is to stand on the tray, and the rake not in the hand. The crate is not (near): the rake must push it.
(define (problem crate-to-tray)
  (:domain tool-use)
  (:objects
    desk tray - surface
    rake crate - item)
  (:init
    (near desk) (near tray) (near rake)
    (tool rake)
    (on rake desk)
    (on crate desk))
  (:goal (and (on crate tray) (not (inhand rake)))))
