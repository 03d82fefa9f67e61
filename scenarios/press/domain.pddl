; A held stick presses buttons: the hand alone is too wide, or the button too far.
(define (domain press)
  (:requirements :strips :typing :equality :negative-preconditions :universal-preconditions)
  (:types support - object  stick button - support)
  (:predicates (inhand ?s - stick) (on ?s - stick ?p - support) (pressed ?b - button))
  (:action pick
    :parameters (?s - stick)
    :precondition (forall (?t - stick) (not (inhand ?t)))
    :effect (and (inhand ?s) (forall (?p - support) (not (on ?s ?p)))))
  (:action place
    :parameters (?s - stick ?p - support)
    :precondition (and (inhand ?s) (not (= ?s ?p)))
    :effect (and (on ?s ?p) (not (inhand ?s))))
  (:action press
    :parameters (?s - stick ?b - button)
    :precondition (inhand ?s)
    :effect (pressed ?b)))
